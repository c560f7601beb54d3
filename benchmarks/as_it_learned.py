"""Does a training learn here as it learned in the original? A console run from nothing, everything of it known.

    .venv/bin/python benchmarks/as_it_learned.py RUN --track reinvent_base.npy --seeds 1,2,3,4,5 --picture learned.png

Trained with exactly its settings: AWS's SHALLOW network, its actions and hyperparameters, iterations of 20 episodes,
starts that advance, the car's camera alone for the critic, too. Compared are the mean progress of the training episodes
of each iteration and their steps. The last line on stdout is JSON.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import json
import statistics
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFont

from racecraft import train

Iterations = list[dict[str, float]]
"""``progress`` in per cent and ``steps``, means over the episodes of each iteration."""
REWARD = """
import math


def reward_function(params):
    if params["is_offtrack"]:
        return -10.0
    reward = 0.1 if params["all_wheels_on_track"] and not params["is_reversed"] else 0.0
    waypoints = params["waypoints"]
    ahead = waypoints[(params["closest_waypoints"][1] + 3) % len(waypoints)]
    direction = math.degrees(math.atan2(ahead[1] - params["y"], ahead[0] - params["x"]))
    difference = abs(direction - params["heading"])
    if difference > 180.0:
        difference = 360.0 - difference
    reward += math.cos(math.radians(difference)) * params["speed"] / 4.0
    if params["steps"] % 100 == 0 and params["progress"] > params["steps"] / 300.0 * 100.0:
        reward += 10.0
    return float(reward)
"""
"""That of the run, from its description in words."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="the original's: RUN.json and RUN.csv.gz")
    parser.add_argument("--track", required=True, help="the route it was trained on")
    parser.add_argument("--seeds", default="1,2,3,4,5", help="as 1,2,3")
    parser.add_argument("--vehicle", default="v5")
    parser.add_argument("--camera", default="2018", help="2026 has pictures as old as the original's")
    parser.add_argument("--num-threads", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, help="the table; seeds that are whole in it are not trained again")
    parser.add_argument("--picture", type=Path, help="draw the curves here")
    options = parser.parse_args()

    known = json.loads(options.run.with_suffix(".json").read_text(encoding="utf-8"))
    per_iteration = known["hyperparameters"]["num_episodes_between_training"]
    real = of_the_original(options.run.with_suffix(".csv.gz"), known, per_iteration)
    learned: dict[str, Iterations] = {}
    if options.output is not None and options.output.exists():
        learned = json.loads(options.output.read_text(encoding="utf-8"))["seeds"]
    for seed in options.seeds.split(","):
        if len(learned.get(seed, [])) < len(real):
            learned[seed] = learn(known, int(seed), options, num_episodes=per_iteration * len(real))
        found = learned[seed]
        print(f"seed {seed}: {shown(found, 'progress')} % of a lap, {shown(found, 'steps')} steps", flush=True)
        if options.output is not None:
            table = {"original": real, "seeds": learned}
            options.output.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    ours = list(learned.values())
    print(f"original: {shown(real, 'progress')} % of a lap, {shown(real, 'steps')} steps")
    inside = []
    for number, iteration in enumerate(real):
        values = sorted(run[number]["progress"] for run in ours if number < len(run))
        inside.append(values[0] <= iteration["progress"] <= values[-1])
        print(
            f"iteration {number + 1}: original {iteration['progress']:.0f} %, here {values[0]:.0f} to {values[-1]:.0f},"
            f" median {statistics.median(values):.0f} %"
        )
    if options.picture is not None:
        draw(real, ours, options.picture)
    print(json.dumps({"iterations": len(real), "inside_the_band": sum(inside)}))


def of_the_original(path: Path, known: dict[str, Any], per_iteration: int) -> Iterations:
    """Mean progress (%) and steps of the original's training episodes, by iteration."""
    with gzip.open(path, "rt", encoding="utf-8") as file:
        steps = Counter(int(float(row["episode"])) for row in csv.DictReader(file))
    trials = [row for row in known["metrics"]["metrics"] if row["phase"] == "training"]
    progress = [float(row["completion_percentage"]) for row in trials]
    return by_iteration(progress, [steps[episode] for episode in sorted(steps)], per_iteration)


def learn(known: dict[str, Any], seed: int, options: argparse.Namespace, *, num_episodes: int) -> Iterations:
    """The same of a training here."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        hyperparameters = {**known["hyperparameters"], "term_cond_max_episodes": num_episodes}
        metadata = {name: known[name] for name in ("action_space", "sensor", "neural_network", "action_space_type")}
        metadata |= {"training_algorithm": known["training_algorithm"], "version": "5"}
        (folder / "reward_function.py").write_text(REWARD, encoding="utf-8")
        (folder / "hyperparameters.json").write_text(json.dumps(hyperparameters), encoding="utf-8")
        (folder / "model_metadata.json").write_text(json.dumps(metadata), encoding="utf-8")
        result = train(
            options.track,
            reward=folder / "reward_function.py",
            model_metadata=folder / "model_metadata.json",
            hyperparameters=folder / "hyperparameters.json",
            until="10 hours",
            critic="camera",
            vehicle=options.vehicle,
            camera=options.camera,
            seed=seed,
            num_threads=options.num_threads,
            root=folder / "runs",
        )
        document = json.loads((result.run / "metrics" / "TrainingMetrics.json").read_text(encoding="utf-8"))
        steps: Counter[int] = Counter()
        for path in (result.run / "training-simtrace").glob("*.csv"):
            with path.open(encoding="utf-8", newline="") as file:
                steps.update(int(float(row["episode"])) for row in csv.DictReader(file))
    trials = [row for row in document["metrics"] if row["phase"] == "training"][:num_episodes]
    counts = [steps[episode] for episode in sorted(steps)][:num_episodes]
    per_iteration = known["hyperparameters"]["num_episodes_between_training"]
    return by_iteration([float(row["completion_percentage"]) for row in trials], counts, per_iteration)


def by_iteration(progress: list[float], steps: list[int], size: int) -> Iterations:
    return [
        {"progress": statistics.fmean(progress[i : i + size]), "steps": statistics.fmean(steps[i : i + size])}
        for i in range(0, len(progress) - size + 1, size)
    ]


def shown(iterations: Iterations, what: str) -> str:
    return ", ".join(f"{iteration[what]:.0f}" for iteration in iterations)


def draw(real: Iterations, ours: list[Iterations], path: Path) -> None:
    """Mean progress by iteration: every seed and their median in blue, the original in orange; what Pillow writes."""
    width, height, left, bottom, fine = 900, 480, 70, 60, 3
    image = Image.new("RGB", (fine * width, fine * height), (255, 255, 255))
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(15 * fine)
    ink, seed_color, median_color, real_color = (70, 76, 88), (186, 205, 235), (36, 92, 190), (232, 111, 32)

    def at(number: float, progress: float) -> tuple[float, float]:
        x = left + (width - left - 30) * number / max(len(real) - 1, 1)
        return fine * x, fine * (height - bottom - (height - bottom - 50) * progress / 100.0)

    for percent in range(0, 101, 20):
        pen.line([at(0, percent), at(len(real) - 1, percent)], fill=(228, 230, 234), width=fine)
        pen.text((at(0, percent)[0] - 10 * fine, at(0, percent)[1]), f"{percent} %", fill=ink, font=font, anchor="rm")
    for number in range(len(real)):
        pen.text((at(number, 0)[0], at(0, 0)[1] + 20 * fine), str(number + 1), fill=ink, font=font, anchor="mm")
    driven = [[run[number]["progress"] for run in ours if number < len(run)] for number in range(len(real))]
    middle = [statistics.median(values) for values in driven if len(values) == len(ours)]
    curves = [([iteration["progress"] for iteration in run], seed_color, 2) for run in ours]
    curves += [(middle, median_color, 4), ([iteration["progress"] for iteration in real], real_color, 4)]
    for values, color, thickness in curves:
        pen.line([at(*point) for point in enumerate(values)], fill=color, width=thickness * fine, joint="curve")
    for column, (text, color) in enumerate(
        [("each seed here", seed_color), ("their median", median_color), ("the original", real_color)]
    ):
        x = (left + 10 + 190 * column) * fine
        pen.line([(x, 25 * fine), (x + 30 * fine, 25 * fine)], fill=color, width=4 * fine)
        pen.text((x + 40 * fine, 25 * fine), text, fill=ink, font=font, anchor="lm")
    label = "iteration of 20 episodes; mean progress of the training episodes"
    pen.text((fine * (width - 30), fine * (height - 12)), label, fill=ink, font=font, anchor="rm")
    image.resize((width, height), Image.Resampling.LANCZOS).save(path)


if __name__ == "__main__":
    main()
