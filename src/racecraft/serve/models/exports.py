"""Models for other machines: the archive that a physical car takes, and ONNX for any program."""

from __future__ import annotations

import tempfile
from enum import StrEnum
from pathlib import Path

from fastapi import APIRouter, Query, Response

from racecraft.errors import CheckpointError
from racecraft.run import RunFolder
from racecraft.serve.context import InContext
from racecraft.serve.models.schemas import ExportNotes
from racecraft.serve.problems import NotFound

router = APIRouter(prefix="/api/models/{name}/export", tags=["archives"])


class Target(StrEnum):
    """What a model can become here; what takes large libraries is the command line's."""

    CAR = "car"
    ONNX = "onnx"


@router.get("")
def get_export(name: str, context: InContext) -> ExportNotes:
    """What a car would do otherwise than the simulator; a model that no car can drive is refused with the reason."""
    from racecraft.car.metadata import car_metadata, car_notes
    from racecraft.race.policy import network_of

    folder = context.garage.folder(name)
    try:
        saved, metadata = folder.checkpoints.find("best"), folder.read_model_metadata()
    except CheckpointError as error:
        raise NotFound(f"Model {folder.name!r} has no checkpoint that can be read.") from error
    spec = network_of(saved, metadata)
    car_metadata(metadata, spec)
    return ExportNotes(step=saved.step, network=spec.name, notes=car_notes(metadata, spec))


@router.get(
    "/{target}",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}}},
)
def get_exported(
    name: str,
    target: Target,
    context: InContext,
    checkpoint: str = Query("best", pattern=r"^(best|last|[0-9]{1,18})$"),
) -> Response:
    """A model as the archive that a physical car takes, or its network as ONNX."""
    data, file = _exported(context.garage.folder(name), target, checkpoint)
    headers = {"Content-Disposition": f'attachment; filename="{file}"'}
    return Response(data, media_type="application/octet-stream", headers=headers)


def _exported(folder: RunFolder, target: Target, checkpoint: str) -> tuple[bytes, str]:
    from racecraft.car import export_run
    from racecraft.car.archive import archive_name

    name = archive_name(folder.name) if target is Target.CAR else f"{folder.name}.onnx"
    with tempfile.TemporaryDirectory(prefix="racecraft-export-") as place:
        try:
            exported = export_run(folder.path, to=target, output=Path(place) / name, checkpoint=checkpoint)
        except CheckpointError as error:  # which names a path of the server
            raise NotFound(f"Model {folder.name!r} has no checkpoint {checkpoint} that can be read.") from error
        return exported.file.read_bytes(), name
