"""The process in which a file of somebody's is read first (`echousd.stage.apart`): reads every value, then composes.

Run by its path, with JSON on stdin: the files, and the bytes of memory that each may take, in all and for each of its
own. It imports nothing of ours, as that would take most of its time. On stdout it names each file before it reads it,
so that whoever waits knows the last one.
"""

import json
import os
import sys


def limit(size: int, in_all: int, each: int) -> None:
    """Have the process hold no more than a file of this size may take."""
    if sys.platform == "linux":
        import resource

        with open("/proc/self/status") as file:  # noqa: PTH123
            words = file.read().split()
        held = int(words[words.index("VmData:") + 1]) << 10
        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        most = held + in_all + each * size
        resource.setrlimit(resource.RLIMIT_DATA, (most if hard < 0 else min(most, hard), hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def read(path: str, memory: list, seen: set) -> bool:
    """Read all values of a layer and of those it depends on; False where one is no regular file."""
    from pxr import Ar, Sdf

    if path in seen:
        return True
    seen.add(path)
    file = Ar.SplitPackageRelativePathOuter(path)[0]
    if not os.path.isfile(file):  # noqa: PTH113
        return not os.path.exists(file)  # noqa: PTH110  # a pipe would wait for ever; who opens it later refuses it
    print(json.dumps(path), flush=True)  # noqa: T201
    limit(os.path.getsize(file), *memory)  # noqa: PTH202
    names: list = []
    try:
        layer = Sdf.Layer.FindOrOpen(path)
        if not layer:
            return True
        paths: list = []
        layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
        for at in paths:
            read_spec(layer, at)
        named = [*layer.GetCompositionAssetDependencies(), *clips(layer, paths)]
        found = [layer.ComputeAbsolutePath(name) for name in named if name]
        names = [str(Ar.GetResolver().Resolve(name)) for name in found]
    except MemoryError:
        os.abort()
    except Exception:  # told by whoever opens it next
        return True
    return all([read(name, memory, seen) for name in names if name])


def clips(layer, paths: list) -> list:
    """The layers that value clips of a layer name, which are no dependencies of its composition."""
    specs = [layer.GetPrimAtPath(at) for at in paths if at.IsPrimPath()]
    sets = [dict(spec.GetInfo("clips")) for spec in specs if spec and spec.HasInfo("clips")]
    values = [value for each in sets for one in each.values() for value in dict(one).values()]
    assets = [asset for value in values for asset in (value if hasattr(value, "__len__") else [value])]
    return [asset.path for asset in assets if hasattr(asset, "path")]


def read_spec(layer, at) -> None:
    """Read the values of a prim or property."""
    spec = layer.GetObjectAtPath(at)
    for key in spec.ListInfoKeys() if spec else ():
        try:
            spec.GetInfo(key)
        except MemoryError:
            os.abort()
        except Exception:  # told by whoever reads it next
            continue
    for time in layer.ListTimeSamplesForPath(at) if at.IsPropertyPath() else ():
        layer.QueryTimeSample(at, time)


def main() -> None:
    """Read the files that stdin names."""
    from pxr import Usd

    request = json.load(sys.stdin)
    for path in request["files"]:
        if read(path, request["memory"], set()):
            print(json.dumps(path), flush=True)  # noqa: T201
            try:
                stage = Usd.Stage.Open(path)
                for _ in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()) if stage else ():
                    pass
            except MemoryError:
                os.abort()
            except Exception:  # told by whoever opens it next
                continue


if __name__ == "__main__":
    main()
