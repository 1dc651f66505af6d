"""What pyproject.toml cannot say: three source folders make up the three packages.

And how an editable install finds them.
"""

import base64
import hashlib
import zipfile
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.editable_wheel import editable_wheel

ROOT = Path(__file__).resolve().parent
# The finder of an editable install is asked last. Beside the clone, a folder called echousd without a package in it
# would be found before, as an empty namespace: ours is asked first.
FIRST = "; import sys; sys.meta_path.sort(key=lambda finder: getattr(finder, '__module__', '') != '{module}')"


def told(line: str) -> bytes:
    """What the .pth file of an editable install says, whose only line was `line`.

    Tools that read types without running the finder, such as mypy, look along its paths.
    """
    finder = line.split()[1].rstrip(";")
    return "\n".join([line + FIRST.format(module=finder), str(ROOT), str(ROOT / "model"), ""]).encode()


class Editable(editable_wheel):
    """An editable install that a clone's own folder cannot shadow, and whose types mypy finds."""

    def run(self) -> None:
        """Make the wheel, then have its finder go first and its paths be told."""
        super().run()
        for path in Path(self.dist_dir).glob("*editable*.whl"):
            with zipfile.ZipFile(path) as wheel:
                files = {entry.filename: wheel.read(entry) for entry in wheel.infolist()}
            for name in [name for name in files if name.endswith(".pth") and b"finder.install()" in files[name]]:
                files[name] = told(files[name].decode().strip())
                record = next(other for other in files if other.endswith(".dist-info/RECORD"))
                digest = base64.urlsafe_b64encode(hashlib.sha256(files[name]).digest()).rstrip(b"=").decode()
                rows = [row for row in files[record].decode().splitlines() if not row.startswith(f"{name},")]
                files[record] = "\n".join([*rows, f"{name},sha256={digest},{len(files[name])}", ""]).encode()
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
                for name, content in files.items():
                    wheel.writestr(name, content)


setup(
    packages=[
        *find_packages(".", include=["echousd", "echousd.*"]),
        *find_packages("model", include=["echomodel", "echomodel.*", "echoscene"]),
        "echousd.schemas",
    ],
    package_dir={"echomodel": "model/echomodel", "echoscene": "model/echoscene", "echousd.schemas": "schemas"},
    cmdclass={"editable_wheel": Editable},
)
