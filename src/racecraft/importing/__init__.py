"""Files of the original: folders, downloads and archives of others become runs that can be trained."""

from racecraft.importing.archive import read_archive
from racecraft.importing.importer import import_run
from racecraft.importing.report import ImportedRun

__all__ = ["ImportedRun", "import_run", "read_archive"]
