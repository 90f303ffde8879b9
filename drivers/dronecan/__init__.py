"""DroneCAN (UAVCAN v0) on our bus: transfers by the library `dronecan`, and the motor controllers that speak it."""
