"""Driver of Universal Robots arms: RTDE, URScript, dashboard and the ur_rtde wheel."""
