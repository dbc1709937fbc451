"""What helps to find the way: where the task's place is, and how one gets there."""

from paravol.guide.guide import Guide, GuideMark
from paravol.guide.names_in_view import NameMark, names_in_view

__all__ = ["Guide", "GuideMark", "NameMark", "names_in_view"]
