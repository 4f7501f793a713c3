"""The station: jobs that survive, and their state as operators and programs see it."""
import station_movement
import station_disturbed
import station_fuzz
import station_kill
import station_load
import station_sanitize
import station_security
import station_soak
import station_stages
import station_startup
import station_view_cost

PARTS = {"startup": station_startup.measure, "movement": station_movement.measure, "kill": station_kill.measure,
         "disturbed": station_disturbed.measure, "stages": station_stages.measure,
         "view_cost": station_view_cost.measure, "load": station_load.measure, "security": station_security.measure,
         "soak": station_soak.measure, "fuzz": station_fuzz.measure, "asan": station_sanitize.ASAN.measure,
         "tsan": station_sanitize.TSAN.measure}
