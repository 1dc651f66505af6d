"""What EchoUSD finds on this machine, and what to do about each gap."""

import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module, metadata, util
from pathlib import Path

from echomodel.files import SHIPPED, tables
from echousd import plugin

EXTRAS = tables("extras.toml", __file__)
GPUS = ("/dev/nvidiactl", "/dev/dxg", "/dev/kfd", "/dev/accel")  # on Linux; without one torch finds the processor alone
OLDEST = (0, 24, 11)  # the first OpenUSD with UsdSemantics


@dataclass(frozen=True)
class Diagnosis:
    """One thing looked at; `state` is ok, gap (something will not work) or optional (an extra not installed)."""

    name: str
    state: str
    found: str
    remedy: str = ""


def diagnose() -> list[Diagnosis]:
    """Look at the USD provider, the schema plugin, torch, the weights and the optional extras."""
    python = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    return [Diagnosis("python", "ok", python), *_usd(), *_plugin(), *_torch(), *_weights(), *_extras()]


def _usd() -> Iterator[Diagnosis]:
    if util.find_spec("pxr") is None:
        yield Diagnosis("usd", "gap", "no pxr module", "pip install usd-core")
        return
    from pxr import Usd

    version = Usd.GetVersion()
    by = sorted({f"{name} {metadata.version(name)}" for name in metadata.packages_distributions().get("pxr", [])})
    text = f"OpenUSD {version[1]}.{version[2]:02d} from {' and '.join(by) or import_module('pxr').__path__[0]}"
    if len(by) > 1:
        yield Diagnosis("usd", "gap", text, "two distributions share the module pxr: uninstall one of them")
    elif version < OLDEST or util.find_spec("pxr.UsdSemantics") is None:
        yield Diagnosis("usd", "gap", text, "OpenUSD 24.11 or newer is needed (UsdSemantics): pip install -U usd-core")
    else:
        yield Diagnosis("usd", "ok", text)


def _plugin() -> Iterator[Diagnosis]:
    folder = plugin.plugin_path()
    if util.find_spec("pxr") is None:
        yield Diagnosis("schema plugin", "gap", f"not active, {folder}", "install a pxr first")
    elif plugin.is_active():
        yield Diagnosis("schema plugin", "ok", f"active, {folder}")
    else:
        remedy = f"import echousd before a stage is opened, or set {plugin.ENVIRONMENT_VARIABLE}={folder}"
        yield Diagnosis("schema plugin", "gap", f"not active, {folder}", remedy)


def _torch() -> Iterator[Diagnosis]:
    if util.find_spec("torch") is None:
        yield Diagnosis("torch", "gap", "not installed", "pip install torch")
        return
    version = metadata.version("torch")
    if platform.system() == "Linux" and not any(Path(device).exists() for device in GPUS):
        yield Diagnosis("torch", "ok", f"{version}, devices: cpu")  # importing torch takes longer than all the rest
        return
    import torch

    devices = [f"cpu ({torch.get_num_threads()} threads)"]
    devices += [f"cuda:{i} ({torch.cuda.get_device_name(i)})" for i in range(torch.cuda.device_count())]
    if torch.backends.mps.is_available():
        devices.append("mps")
    yield Diagnosis("torch", "ok", f"{torch.__version__}, devices: {', '.join(devices)}")


def _weights() -> Iterator[Diagnosis]:
    files = [f"{file.name} ({file.stat().st_size / 2**20:.1f} MiB)" for file in sorted(SHIPPED.glob("*.safetensors"))]
    if files:
        yield Diagnosis("weights", "ok", f"{', '.join(files)} in {SHIPPED}")
    else:
        yield Diagnosis("weights", "gap", f"no .safetensors file in {SHIPPED}", "reinstall echousd, or echousd train")


def _extras() -> Iterator[Diagnosis]:
    for extra, row in EXTRAS.items():
        if any(util.find_spec(module) is None for module in row["modules"]):
            remedy = f"pip install 'echousd[{extra}]'"
            yield Diagnosis(f"extra {extra}", "optional", f"not installed ({row['for']})", remedy)
        else:
            yield Diagnosis(f"extra {extra}", "ok", f"installed ({row['for']})")
