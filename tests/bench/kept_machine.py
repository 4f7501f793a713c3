"""A bare Debian kept in build/NAME with its packages, compiler cache, build and results: a second run is quick."""
import os
import pathlib
import shutil

import bare_machine

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


class KeptMachine:
    def __init__(self, name, suite):
        self.folder, self.suite = ROOT / "build" / name, suite

    def root(self):
        """Root folder of the machine, made at the first call."""
        root = self.folder / "root"
        if not root.is_dir():
            making = self.folder / "making"
            shutil.rmtree(making, ignore_errors=True)
            making.parent.mkdir(parents=True, exist_ok=True)
            bare_machine.make(self.suite, making)
            making.rename(root)
        return root

    def shell(self, line):
        """Command line that runs a shell line in this tree inside; its build/ and out/ are separate."""
        binds = [(ROOT, "scanrig")]
        for folder in ("build", "out"):
            (self.folder / folder).mkdir(parents=True, exist_ok=True)
            (ROOT / folder).mkdir(exist_ok=True)
            binds.append((self.folder / folder, f"scanrig/{folder}"))
        data = pathlib.Path(os.environ.get("SCANRIG_SHARED_DATA", ROOT.parent / "shared" / "data"))
        if data.is_dir():
            binds.append((data, "shared/data"))
        return bare_machine.entrance(self.root(), f"cd /scanrig && export SCANRIG_SHARED_DATA=/shared/data; {line}", binds)
