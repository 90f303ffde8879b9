"""An ODrive axis, as it talks CANSimple."""
