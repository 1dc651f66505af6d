"""Where the USD schema plugin lies, and how any pxr of this process comes to know it. Importing this needs no pxr."""

import os
import sys
import warnings
from functools import cache
from importlib import resources
from pathlib import Path

ENVIRONMENT_VARIABLE = "PXR_PLUGINPATH_NAME"


class PluginNotActive(UserWarning):
    """The plugin was registered after the process had opened a stage, which USD ignores."""


@cache
def plugin_path() -> Path:
    """Folder that holds plugInfo.json: what `PXR_PLUGINPATH_NAME` must list. Raises FileNotFoundError if it is gone."""
    try:
        folder = Path(str(resources.files("echousd.schemas").joinpath("resources")))
    except (ModuleNotFoundError, TypeError):  # the source tree on sys.path without an installation
        folder = Path(__file__).parents[1] / "schemas" / "resources"
    if not (folder / "plugInfo.json").is_file():
        raise FileNotFoundError(f"{folder}: the schema plugin of echousd is missing, reinstall echousd")
    return folder


def register() -> None:
    """Make the schema known to USD without importing pxr.

    Where pxr is not loaded yet, its search path is extended by an environment variable, which it reads when it is
    loaded (so do child processes). Where it is, the plugin is registered at once; USD ignores that silently if the
    process opened a stage before, so then a `PluginNotActive` warning names the remedy.
    """
    folder = str(plugin_path())
    listed = os.environ.get(ENVIRONMENT_VARIABLE, "")
    if folder not in listed.split(os.pathsep):
        os.environ[ENVIRONMENT_VARIABLE] = os.pathsep.join([folder, listed] if listed else [folder])
    if "pxr" not in sys.modules:
        return
    from pxr import Plug

    Plug.Registry().RegisterPlugins(folder)
    if "pxr.Usd" in sys.modules and not is_active():
        warnings.warn(
            "the EchoUSD schema is not active: this process opened a stage before `import echousd`; import echousd "
            f"first, or start with {ENVIRONMENT_VARIABLE}={folder} (echousd plugin-path prints it)",
            PluginNotActive,
            stacklevel=3,
        )


def is_active() -> bool:
    """Whether USD knows EchoSceneGraph, EchoOpening, EchoRelation and EchoNodeAPI in this process (loads pxr)."""
    from pxr import Usd

    registry = Usd.SchemaRegistry()
    typed = (registry.FindConcretePrimDefinition(name) for name in ("EchoSceneGraph", "EchoOpening", "EchoRelation"))
    return all(typed) and registry.FindAppliedAPIPrimDefinition("EchoNodeAPI") is not None
