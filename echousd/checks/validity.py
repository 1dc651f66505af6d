"""USD validity: UsdValidation's validators and our own rules in one run."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

from pxr import Plug, Sdf, Tf, Usd, UsdUtils

import echousd
from echousd.checks.findings import RULES, Finding, Rule
from echousd.checks.reading import Reading
from echousd.stage.encoding import StageError
from echousd.stage.files import said
from echousd.stage.layouts import ARTICULATED, ARTICULATION, showing_variant

FAMILIES = ("object", "look", "mesh", "physics", "file")
for family in FAMILIES:
    importlib.import_module(f"echousd.checks.{family}_rules")  # its rules enter the table
JOINED = tuple(rule for rule in RULES if rule.name in ("echo:Joints", "echo:PhysicsValues"))
ALONE = "echo:Validators"
UNKNOWN_NODE, MATERIALX = ".MissingShaderIdInRegistry", "shaderId 'ND_"


@dataclass(frozen=True, order=True)
class Fault:
    """A fault of the stage: which rule found it, at which prim, and what it says."""

    rule: str
    prim: str
    message: str

    def to_json(self) -> dict:
        """The entry of the report."""
        return {"rule": self.rule, "prim": self.prim, "message": self.message}


def safely(rule: Rule, reading: Reading) -> list[Finding]:
    """What a rule finds; a stage that it cannot read through is a finding as well."""
    found: list[Finding] = []
    try:
        found.extend(rule.find(reading))
    except Tf.ErrorException as error:
        found.append(Finding(Sdf.Path.absoluteRootPath, f"cannot be read through: {said(error)}"))
    except StageError as error:
        found.append(Finding(Sdf.Path.absoluteRootPath, str(error)))
    return found


def find_faults(stage: Usd.Stage) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """Errors and warnings of all validators, in a stable order; ours share what they read of the stage.

    An OpenUSD without UsdValidation runs our rules alone and says so in a warning.
    """
    assert echousd.__version__  # importing the package registers the schema plugin
    reading = Reading(stage)
    own = [(rule, found) for rule in RULES for found in safely(rule, reading)]
    with showing_variant(stage, ARTICULATION, ARTICULATED) as changed:  # doors and drawers are joined in it alone
        own += [(rule, found) for rule in JOINED if changed for found in safely(rule, Reading(stage))]
    errors, warnings = _faults_of_usd(stage)
    for rule, found in own:
        (warnings if found.warning else errors).add(Fault(rule.name, str(found.path), found.message))
    return tuple(sorted(errors)), tuple(sorted(warnings))


def _faults_of_usd(stage: Usd.Stage) -> tuple[set[Fault], set[Fault]]:
    """Errors and warnings of OpenUSD's own validators."""
    try:
        from pxr import UsdValidation

        known = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    except (ImportError, AttributeError, TypeError):
        version = ".".join(map(str, Usd.GetVersion()))
        alone = f"OpenUSD {version} has no UsdValidation for Python: only our own rules ran"
        return set(), {Fault(ALONE, "/", alone)}
    context = UsdValidation.ValidationContext(known)
    silence = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what the report says as well
    try:
        told = context.Validate(stage)
    except Tf.ErrorException as stopped:  # a validator that cannot read the stage ends the whole run
        return {Fault(ALONE, "/", f"OpenUSD's validators stopped: {said(stopped)}")}, set()
    finally:
        silence.TakeUncoalescedDiagnostics()
        del silence
    errors, warnings = set(), set()
    knows_materialx = bool(Plug.Registry().GetPluginWithName("usdMtlx"))  # usd-core comes without it
    for error in told:
        name = f"{error.GetValidator().GetMetadata().name}.{error.GetName()}"
        fault = Fault(name, _site(error), " ".join(error.GetMessage().split()))
        if not knows_materialx and fault.rule.endswith(UNKNOWN_NODE) and MATERIALX in fault.message:
            continue
        if error.GetType() == UsdValidation.ValidationErrorType.Error:
            errors.add(fault)
        elif error.GetType() == UsdValidation.ValidationErrorType.Warn:
            warnings.add(fault)
    return errors, warnings


def _site(error: Any) -> str:
    for site in error.GetSites():
        if site.IsPrim():
            return str(site.GetPrim().GetPath())
        if site.IsProperty():
            return str(site.GetProperty().GetPath())
        if site.GetLayer():
            return str(site.GetLayer().GetDisplayName())
    return str(Sdf.Path.absoluteRootPath)
