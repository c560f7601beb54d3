"""The course: lessons as pages, and who has read and answered what."""
