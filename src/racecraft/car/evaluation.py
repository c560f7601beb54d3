"""`racecraft evaluate --as car`: the exported file, driven in the simulator as a physical car drives it.

run -> export_run -> archive -> read_exported -> CarPolicy -> evaluate_run, and a picture of what became of commands
"""

from __future__ import annotations

import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from racecraft.agent.action_space import MAX_SPEED
from racecraft.car.calibration import CarCalibration, load_calibration
from racecraft.car.command import as_driven
from racecraft.car.driving import CAR_CAMERA, CarPolicy
from racecraft.car.export import export_run, read_exported
from racecraft.car.picture import draw_commands
from racecraft.errors import ConfigError
from racecraft.judging.evaluation import RunEvaluation, evaluate_run
from racecraft.judging.trained import trained_camera
from racecraft.race.policy import NetworkPolicy
from racecraft.run import RunFolder
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.simulation import CONTROL_DT

PICTURE: Final = "as-car.png"
TOO_FAST: Final = f"the simulator drives {MAX_SPEED:g} m/s at most"
UNMEASURED: Final = CarCalibration()


def evaluate_as_car(
    run: str | Path,
    *,
    car: CarCalibration | str | Path = UNMEASURED,
    randomize: Randomization | str | Path = "none",
    **settings: Any,
) -> RunEvaluation:
    """Race what a car would make of a run's policy against the clock.

    Args:
        run: The run folder.
        car: What was measured on the car, or its file.
        randomize: Of `evaluate_run`; its latency is the car's, where the car has one.
        **settings: All others of `evaluate_run`.

    Raises:
        RacecraftError: As `evaluate_run` and `export_run`.
    """
    measured = car if isinstance(car, CarCalibration) else load_calibration(car)
    drivers: list[CarPolicy] = []

    def load(folder: RunFolder, *, checkpoint: str | int, num_threads: int) -> tuple[int, NetworkPolicy]:
        with tempfile.TemporaryDirectory(prefix="racecraft-car-") as place:
            exported = export_run(folder.path, output=Path(place) / "model.tar.gz", checkpoint=checkpoint)
            policy = read_exported(exported.file, num_threads=num_threads)
        drivers.append(CarPolicy(policy, measured))
        return exported.step, drivers[0]

    if not isinstance(randomize, Randomization):
        randomize = load_randomization(randomize)
    if measured.latency_seconds:
        steps = measured.latency_seconds / CONTROL_DT
        if randomize.latency != (0.0, 0.0):
            raise ConfigError("The car has a latency, and so has the randomisation.", hint="Leave one of them away.")
        randomize = replace(randomize, latency=(steps, steps))
    folder = RunFolder.open(run)
    space = as_driven(folder.read_model_metadata().action_space)
    camera = replace(trained_camera(folder.read_info()), width=CAR_CAMERA.width, height=CAR_CAMERA.height)
    about = {"as_car": {**asdict(measured), "slider_driven_percent": round(100 * measured.slider(space), 1)}}
    outcome = evaluate_run(run, load=load, camera=camera, randomize=randomize, about=about, **settings)
    (driver,) = drivers
    picture = draw_commands(
        np.concatenate(driver.chosen),
        np.concatenate(driver.resulting),
        driver.listed,
        outcome.files["summary"].with_name(PICTURE),
        note=TOO_FAST if measured.fastest(space) > MAX_SPEED else "",
    )
    return replace(outcome, files={**outcome.files, "as a car": picture})
