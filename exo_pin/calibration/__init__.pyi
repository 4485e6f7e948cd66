from .calibrate_device import calibrate as calibrate
from .information import Information as Information
from .pose_choice import pose_information as pose_information
from .pose_choice import suggest_poses as suggest_poses
from .result import Calibration as Calibration
from .result import FittedDevice as FittedDevice
from .undetermined import Undetermined as Undetermined
