from . import plots as plots
from .colours import LIMB_STYLES as LIMB_STYLES
from .figure.figure import human_urdf as human_urdf
from .page.browser import find_browser as find_browser
from .scene.chain_scene import ChainScene as ChainScene
from .scene.scene_of_exo import Scene as Scene
from .scene.scene_recording import SceneRecording as SceneRecording
