from .calibrate_device import calibrate as calibrate
from .fitted_device import FittedDevice as FittedDevice
from .information import Information as Information
from .pose_choice import pose_information as pose_information
from .pose_choice import suggest_poses as suggest_poses
from .result import Calibration as Calibration
from .undetermined import Undetermined as Undetermined
