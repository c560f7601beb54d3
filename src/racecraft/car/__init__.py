"""The physical car: the archive that it takes, and what it makes of a policy's choices."""

from racecraft.car.export import ExportedModel, export_run

__all__ = ["ExportedModel", "export_run"]
