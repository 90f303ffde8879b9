"""An ESC, as it talks DroneCAN (UAVCAN v0)."""
