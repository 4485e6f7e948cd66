from .figure.human_figure import human_urdf as human_urdf
from .limb_styles import LIMB_STYLES as LIMB_STYLES
from .page.browser import Browser as Browser
from .page.browser import find_browser as find_browser
from .page.recording import Recording as Recording
from .page.slider_panel import Sliders as Sliders
from .scene.chain_scene import ChainScene as ChainScene
from .scene.scene_of_exo import Scene as Scene
