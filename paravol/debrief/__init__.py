"""What a recorded session is talked over with: one page that needs nothing else.

`findings` gathers, `events` tells what happened, `pictures` draws moments, `charts`
draws figures, `page` writes the file.
"""

from paravol.debrief.debrief_file import WrittenDebrief, write_debrief
from paravol.debrief.pictures import DebriefOrder

__all__ = ["DebriefOrder", "WrittenDebrief", "write_debrief"]
