"""USD validity: UsdValidation's validators and our own rules, registered as UsdValidation validators, in one run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pxr import Sdf, Usd

import echousd
from echousd.check import file_rules, geometry_rules, graph_rules, physics_rules
from echousd.check.findings import Finding, Rule

RULES: tuple[Rule, ...] = (*graph_rules.RULES, *geometry_rules.RULES, *physics_rules.RULES, *file_rules.RULES)
KEYWORD = "EchoUSD"


@dataclass(frozen=True)
class Fault:
    """A fault of the stage: which rule found it, at which prim, and what it says."""

    rule: str
    prim: str
    message: str

    def to_json(self) -> dict:
        """The entry of the report."""
        return {"rule": self.rule, "prim": self.prim, "message": self.message}


def register() -> None:
    """Register our rules as UsdValidation stage validators (once per process)."""
    from pxr import UsdValidation

    registry = UsdValidation.ValidationRegistry()
    for rule in RULES:
        if not registry.HasValidator(rule.name):
            metadata = UsdValidation.ValidatorMetadata(
                name=rule.name, doc=rule.doc, keywords=[KEYWORD], schemaTypes=[], isTimeDependent=False
            )
            registry.RegisterStageValidator(metadata, _validator(rule))


def _validator(rule: Rule) -> Callable[[Usd.Stage, Any], list]:
    def validate(stage: Usd.Stage, _time: Any) -> list:
        from pxr import UsdValidation

        kinds = UsdValidation.ValidationErrorType
        return [
            UsdValidation.ValidationError(
                rule.name.partition(":")[2],
                kinds.Warn if found.warning else kinds.Error,
                [UsdValidation.ValidationErrorSite(stage, found.path)],
                found.message,
            )
            for found in rule.find(stage)
        ]

    return validate


def find_faults(stage: Usd.Stage) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """Errors and warnings of all validators, in a stable order.

    An OpenUSD without UsdValidation runs our rules alone and says so in a warning.
    """
    assert echousd.__version__  # importing the package registers the schema plugin
    try:
        from pxr import UsdValidation

        register()
    except (ImportError, AttributeError, TypeError):
        own = [(rule, found) for rule in RULES for found in rule.find(stage)]
        errors = [_fault(rule, found) for rule, found in own if not found.warning]
        warnings = [_fault(rule, found) for rule, found in own if found.warning]
        alone = (
            f"OpenUSD {'.'.join(map(str, Usd.GetVersion()))} has no UsdValidation for Python: only our own rules ran"
        )
        return tuple(errors), (*warnings, Fault("echo:Validators", "/", alone))
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    errors, warnings = [], []
    for error in context.Validate(stage):
        fault = Fault(_rule_name(error), _site(error), " ".join(error.GetMessage().split()))
        if error.GetType() == UsdValidation.ValidationErrorType.Error:
            errors.append(fault)
        elif error.GetType() == UsdValidation.ValidationErrorType.Warn:
            warnings.append(fault)
    return tuple(sorted(set(errors), key=_key)), tuple(sorted(set(warnings), key=_key))


def _fault(rule: Rule, found: Finding) -> Fault:
    return Fault(rule.name, str(found.path), found.message)


def _key(fault: Fault) -> tuple[str, str, str]:
    return fault.rule, fault.prim, fault.message


def _rule_name(error: Any) -> str:
    name = error.GetValidator().GetMetadata().name
    return name if name.startswith("echo:") else f"{name}.{error.GetName()}"


def _site(error: Any) -> str:
    for site in error.GetSites():
        if site.IsPrim():
            return str(site.GetPrim().GetPath())
        if site.IsProperty():
            return str(site.GetProperty().GetPath())
        if site.GetLayer():
            return str(site.GetLayer().GetDisplayName())
    return str(Sdf.Path.absoluteRootPath)
