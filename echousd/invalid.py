"""What pydantic found wrong with somebody's data, in one line."""

import re

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo


def validation_message(error: ValidationError, model: type[BaseModel] = BaseModel) -> str:
    """The first fault in one line: the field, what was found and what is allowed."""
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"]) or "the file"
    if first["type"] == "value_error":
        return str(first["ctx"]["error"])
    if first["type"] == "string_pattern_mismatch":
        pattern = first["ctx"]["pattern"]
        what = "a name of letters, digits and _" if "A-Z" in pattern else "a hexadecimal digest"
        what = "a path of names of letters, digits and _, such as /World/Room" if "/" in pattern else what
        return f"{where} is {first['input']!r:.100}, allowed: {what}"
    if first["type"] == "extra_forbidden":
        return f"{where} is no option, allowed: {', '.join(sorted(model.model_fields))}"
    field = model.model_fields.get(str(first["loc"][0])) if first["loc"] else None
    limits = (
        limits_of(field) if field is not None and first["type"] in ("greater_than_equal", "less_than_equal") else ""
    )
    words = re.sub("^Input should be ", "", first["msg"]).replace("'", "")
    return f"{where} is {first['input']!r:.100}, allowed: {limits or words}"


def limits_of(field: FieldInfo) -> str:
    """The numbers that a field may hold, `1 to 64` or `1 or more`; "" where all are allowed."""
    low = next((one.ge for one in field.metadata if hasattr(one, "ge")), None)
    high = next((one.le for one in field.metadata if hasattr(one, "le")), None)
    return "" if low is None else f"{low} or more" if high is None else f"{low} to {high}"
