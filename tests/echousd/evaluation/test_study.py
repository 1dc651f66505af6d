"""A study with people: the page holds every pair, and answers are counted as they were given."""

import json
import re

import pytest

from echousd.cli.main import run
from echousd.evaluation.suite import preferences, write_study


def test_the_page_stands_alone_and_shows_every_pair(tmp_path):
    page = write_study(["random", "retrieval", "real"], "generated", 2, 0, tmp_path / "s.html").read_text("utf-8")
    content = json.loads(re.search(r"const content = (\{.*\});", page)[1])
    assert [(p["room"], p["one"], p["other"]) for p in content["pairs"]][:3] == [
        (0, "random", "retrieval"), (0, "random", "real"), (0, "retrieval", "real"),
    ]  # fmt: skip
    assert len(content["pictures"]) == 6
    assert "http" not in page.replace("https://", "http")
    shown = re.sub(r"<script>.*</script>", "", page, flags=re.DOTALL)
    assert not {"random", "retrieval"} & set(re.findall(r"\w+", shown))  # nobody sees who made what
    with pytest.raises(ValueError, match="1 systems that can be asked the same rooms, allowed: 2 or more"):
        write_study(["random"], "generated", 2, 0, tmp_path / "s.html")


def answer(choice, one="a", other="b", first=None):
    return {"room": 0, "one": one, "other": other, "choice": choice, "first": first}


def test_answers_are_counted_tested_and_careless_people_left_out(tmp_path, capsys):
    people = [
        [answer("a")] * 8 + [answer("b")] * 1 + [answer("undecided")] + [answer("a", first="a")] * 2,
        [answer("a")] * 6 + [answer("b")] * 1 + [answer("b", "b", "a")],
        [answer("b")] * 50 + [answer("b", first="a")] * 3,  # answers otherwise when asked again
    ]
    files = [tmp_path / f"{k}.json" for k in range(3)]
    for file, rows in zip(files, people, strict=True):
        file.write_text(json.dumps({"person": 1, "answers": rows}))
    found = preferences(files)
    (pair,) = found["pairs"]
    assert (pair["one"], pair["other"], pair["preferred"], pair["asked"], pair["ties"]) == ("a", "b", 14, 17, 1)
    assert pair["p"] == pytest.approx(0.01272583, abs=1e-6)  # 14 or more, or 3 or fewer, of 17 throws of a coin
    assert pair["low"] < 14 / 17 < pair["high"]
    assert (found["people"], found["kept"], found["repeats"]) == (3, 2, "2 of 5")
    assert run(["eval", "answers", *map(str, files)]) == 0
    assert "a over b: 14 of 17" in capsys.readouterr().out
    for text in ("{}", '{"answers": [[1]]}'):
        files[0].write_text(text)
        assert run(["eval", "answers", str(files[0])]) == 2
        assert "0.json: no answers of a study" in capsys.readouterr().err
