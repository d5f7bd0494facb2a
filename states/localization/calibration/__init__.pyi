from states.localization.calibration.tracker_calibration import (
    GREATEST_OFFSET as GREATEST_OFFSET,
    GREATEST_TURN as GREATEST_TURN,
    BaseReading as BaseReading,
    Calibration as Calibration,
    NoCalibration as NoCalibration,
    TrackerReading as TrackerReading,
    calibrate as calibrate,
)
