from ._scene_file import leaves as leaves
from ._scene_file import read_scene as read_scene
from ._scene_file import scene_from_text as scene_from_text
from ._scene_file import scene_text as scene_text
from ._scene_file import write_scene as write_scene
from .schema import histories as histories
from .schema import history as history
from .shipped_scenes import shipped as shipped
