from .calibrate_device import calibrate as calibrate
from .calibrate_device import pose_information as pose_information
from .calibrate_device import suggest_poses as suggest_poses
from .information import Information as Information
from .information import Undetermined as Undetermined
from .result import Calibration as Calibration
from .result import FittedDevice as FittedDevice
