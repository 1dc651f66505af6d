"""To texturing tools and back: jobs that such tools paint, and painted looks as layers over a room."""

from echousd.texturing.attach import ImportedLook, import_texture_job
from echousd.texturing.export import export_texture_job
from echousd.texturing.job import TOOLS, Job

__all__ = ["TOOLS", "ImportedLook", "Job", "export_texture_job", "import_texture_job"]
