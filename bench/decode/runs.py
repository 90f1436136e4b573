"""Runs of decoders for bench `decode`: sittings of frames to a file, a child process, its answers back."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.support.field.converter_plant import ConverterPlant
from tests.support.field.flat_plant import FlatPlant

ROOT = Path(__file__).parents[2]
LEARNED = 300  # frames of each sitting without a touch


@dataclass
class Sitting:
    """Frames of one sensor that has been learned once.

    Attributes:
        plant: the sheets.
        circuit: the electronics.
        untouched: counts, shape (frames, 10).
        touches: counts, shape (touches, frames, 10).
        drift: standard deviation by which untouched currents may drift from one frame of a touch to the next, as the
            decoder is told, a ratio; 0: its own default.
    """

    plant: FlatPlant
    circuit: ConverterPlant
    untouched: np.ndarray
    touches: np.ndarray
    drift: float = 0.0

    def sensor(self) -> dict[str, float]:
        """Return what a decoder is told."""
        plant, circuit = self.plant, self.circuit
        return {
            "radius1": plant.radius1,
            "radius2": plant.radius2,
            "slant": plant.slant,
            "wrap": plant.wrap,
            "upper": plant.upper,
            "lower": plant.lower,
            "supply": circuit.supply,
            "adc": circuit.adc,
            "bits": circuit.bits,
            "pulldown": circuit.pulldown,
            "input": circuit.input,
            "full_scale": circuit.full_scale,
            "drift": self.drift,
        }


class Decoder:
    """A version of coneskin that decodes.

    Args:
        name: for the tables.
        tree: of its files.
    """

    def __init__(self, name: str, tree: Path) -> None:
        self.name = name
        self.tree = tree

    @classmethod
    def of_commit(cls, commit: str, where: Path) -> Decoder:
        """Return the decoder of a commit, checked out beside its frames."""
        tree = where / commit
        if not tree.exists():
            tree.mkdir()
            archive = subprocess.run(["git", "-C", ROOT, "archive", commit], capture_output=True, check=True).stdout
            subprocess.run(["tar", "-x", "-C", tree], input=archive, check=True)
        return cls(commit, tree)

    def decode(self, sittings: list[Sitting]) -> list[dict[str, np.ndarray]]:
        """Return what it says of each sitting; names as in decode_child.py."""
        data: dict[str, object] = {"sittings": len(sittings)}
        for number, sitting in enumerate(sittings):
            sensor = sitting.sensor()
            data[f"sensor names {number}"] = np.array(list(sensor))
            data[f"sensor {number}"] = np.array(list(sensor.values()), float)
            data[f"untouched {number}"] = sitting.untouched
            data[f"touches {number}"] = sitting.touches
        with tempfile.TemporaryDirectory() as folder:
            frames, answers = Path(folder) / "frames.npz", Path(folder) / "answers.npz"
            with frames.open("wb") as file:
                np.savez(file, **data)  # type: ignore[arg-type]
            environment = os.environ | {"PYTHONPATH": str(self.tree / "src")}
            subprocess.run(
                [sys.executable, "-m", "bench.decode.child", frames, answers], env=environment, cwd=ROOT, check=True
            )
            found = np.load(answers)
            out: list[dict[str, np.ndarray]] = [{} for _ in sittings]
            for key in found.files:
                name, _, number = key.rpartition(" ")
                out[int(number)][name] = found[key]
        return out
