"""attlog: any flight or IMU log into one reviewable MCAP, attitude re-estimated offline, its errors explained."""
