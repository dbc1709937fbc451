"""What an instructor beside the trainee sees of a flight: a page on this machine."""

from paravol.instructor.page_server import InstructorPage

__all__ = ["InstructorPage"]
