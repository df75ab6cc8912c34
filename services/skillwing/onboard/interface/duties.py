"""What the two doors ask of those who go through: duties that no message tells."""

from __future__ import annotations

from skillwing.onboard.guidance.body_motion import (
    ARRIVED_WITHIN,
    AT_REST,
    DRIFT,
    FLARE_HEIGHT,
    MAX_CLIMB,
    PATIENCE,
    TOUCHDOWN_SPEED,
)
from skillwing.onboard.guidance.core import LAND_AFTER as ALONE
from skillwing.onboard.guidance.heading_control import ALIGNED, TURN_RATE
from skillwing.onboard.guidance.limits import (
    FENCE_MARGIN,
    HIGHEST,
    HOLD_TIME,
    LOWEST,
    MAX_SPEED,
    SETPOINT_TIMEOUT,
)
from skillwing.onboard.guidance.path_monitor import MARGIN, STALE
from skillwing.onboard.guidance.trajectory import ACCELERATION, BRAKING

VEHICLE = f"""\
## Another vehicle

It tells `fl/navigation` and `fl/flight`, and follows `fl/autopilot/setpoint`. That is enough for the first nine skills;
`fl/battery` and `fl/range` should be there, too. These are its duties, none of which guidance can do for it:

1. **Follow.** A setpoint is a position with velocity and acceleration to feed forward, and a heading. Paths are flown
   at up to {MAX_SPEED:g} m/s, {MAX_CLIMB:g} m/s up and down, with {ACCELERATION:g} m/s² at their ends and
   {BRAKING:g} m/s² where they are broken off; the heading turns at {TURN_RATE:g} rad/s. Stay within {DRIFT:g} m of the
   path, or the motion is ABORTED. Come to rest ({AT_REST:g} m/s) within {ARRIVED_WITHIN:g} m of its end, or it is
   BLOCKED {PATIENCE:g} s later. Point the nose to within {ALIGNED:g} rad of where it should be, or the turn never ends.
2. **Take off by setpoint.** There is no command for it: on the ground there are no setpoints, and the first one that
   asks for rotors and a place above the vehicle starts them. From then on, and not later than at the height asked
   for, `on_ground` is False; a True in between means to guidance that the vehicle has landed again.
3. **Notice the touchdown.** A landing goes on downwards through the ground, at {TOUCHDOWN_SPEED:g} m/s below
   {FLARE_HEIGHT:g} m, until the vehicle says `on_ground`; no setpoint says `rotors` False. Stop the rotors by yourself
   and tell it: `land` ends when the vehicle is on the ground *and* its rotors are off. Where that is not told before
   the path is {DRIFT:g} m below the vehicle, the landing is BLOCKED.
4. **Look after yourself.** A setpoint counts for {SETPOINT_TIMEOUT:g} s from its `t` on, whenever it arrives, which is
   the `t` of the navigation that it answers; nor does an older one count after a newer one. Without any that counts:
   brake, hold the position. {HOLD_TIME:g} s later: land. A fresh setpoint takes over again. Guidance relies on it: it
   falls silent when nobody has commanded the vehicle for {ALONE:g} s in the air, and so does a guidance that has
   crashed. Say in `failsafe` what is being done; it goes to the timeline.
5. **Overrule where you must.** Critical battery, lost navigation, a failed rotor, a fence of your own: act, and say
   `follows` False. Guidance then gives its motions up, takes none but a landing, and keeps its setpoints where the
   vehicle is, so that nothing jumps afterwards. `holds_heading` False says that the nose can no longer be pointed.
6. **Let the safety pilot decide.** While the pilot's switch is on the remote, `authority` is False and setpoints are
   ignored. Every skill that flies then ends `RI`, by the invariant `authority`, and none starts. Given back, it holds
   its position until somebody commands it.
7. **Tell the truth about yourself.** `home_valid` once the home pad is known: guidance takes the first place on the
   ground with a valid home point for it. A sensor's node judges by the data that come out of it, says OK before
   anybody uses it and FAILED with a reason as soon as they stop, freeze or make no sense; nobody else will. Each
   message of health has a new `id`. `cause` is for simulators, which know which fault they have injected.

Fencing tokens do not come down to the vehicle: guidance has refused what no longer counts.

| of the vehicle | in MAVLink |
|---|---|
| `fl/navigation` | `LOCAL_POSITION_NED` (less the home pad) and `ATTITUDE_QUATERNION`; `valid` and the sigmas from \
`ESTIMATOR_STATUS` |
| `fl/flight` | `EXTENDED_SYS_STATE` (landed), `HEARTBEAT` (armed, mode; authority is: in offboard or guided mode), \
`HOME_POSITION` |
| `fl/battery`, `fl/range` | `BATTERY_STATUS`; `DISTANCE_SENSOR` looking down |
| `fl/autopilot/setpoint` | `SET_POSITION_TARGET_LOCAL_NED` with position, velocity, acceleration and yaw; arm on the \
first one that rises |
| `fl/slam/odometry` | `ODOMETRY`, which autopilots fuse as external vision |
"""

GUIDANCE = f"""\
## Another guidance

Everything above but following setpoints, which it may do as it likes; and `fl/guidance/command`, `fl/guidance/status`,
`fl/geofence`. It listens to `fl/authority`. No such guidance is among the examples; the one that the M600's managers
are tested on (`tests/unit/m600/m600_layer.py`) is the least that they fly with, and has no tokens and no failsafes.

**Two axes**, body and heading, have a holder each: a goal and its token. `Turn` takes the heading, `FlyTo` along the
track or in view and `Orbit` take both, every other motion the body. A command that is taken ends the motion before,
whosever it was: brake, then begin.

| motion | of | is DONE when |
|---|---|---|
| `take_off` | `takeoff` | at rest at that height above the home pad (0.5 m), straight above where it stood (2 m) |
| `fly_to` | `goto` (nose FREE), `goto_straight` (ALONG_TRACK), `return_home` (FREE, then IN_VIEW) | at rest at the \
target |
| `orbit` | `inspect` | all laps are flown; tell `laps_done` |
| `hold` | `hover` | at once; keep holding |
| `turn` | `rotate_head`, `lock_head` (`lock`: keep it afterwards) | the nose is there |
| `land` | `land` | on the ground |
| `stop` | the end of every goal that has not given its axes back | at rest: STOPPED |

A repeated command of the same goal is answered as the first one was, and changes nothing: it comes again where a
reply was lost.

**Tokens** are integers that grow with every grant, whichever skill it is for. Of each axis, remember the newest that
was taken; refuse a smaller one with `STALE_TOKEN`. A `Revoked` says that commands of a goal up to a token no longer
count: if the goal holds an axis, brake and say ABORTED; if its command is still to come, refuse it then. So a manager
that was cut off, and whose goal the resource manager has ended, cannot move the vehicle any more.

**Refuse** besides: `UNAVAILABLE` before the place is known, `NOT_ALLOWED` outside the fence, without the authority,
on the wrong side of the ground, or where the way is too steep for the sensor that is to look along it, `BAD_REQUEST`
for what cannot be flown, `UNKNOWN_GOAL` for a stop of a goal that holds nothing. A sentence that says why, and `help`
that says what to do, reach the user as they are.

**States** of an axis, in the status at 20 Hz, with the holder's goal id also after the end, until somebody else takes
the axis:

| state | means | the skill |
|---|---|---|
| `IDLE` | nobody holds it | fails after 2 s, for nobody flies for it; an interrupted one is over |
| `TURNING`, `MOVING` | under way; `remaining` in m, or rad | goes on |
| `WAITING` | at rest, because obstacle reports are stale, or do not see a way that they should | goes on |
| `STOPPING` | braking | goes on |
| `STOPPED` | a `stop` was carried out; at rest | is interrupted |
| `DONE` | see above; still held | ends with its success |
| `BLOCKED` | at rest before an obstacle, or no headway; still held | ends BLOCKED |
| `ABORTED` | at rest; revoked, out of the fence, drifted off, overruled; given back | ends ABORTED, or fails |

Of the body, the states after STOPPING, and IDLE, promise a vehicle at rest.

**Obstacles.** `target` is where the present way leads, `way` its corners if it is bent: the obstacle node looks along
it, and reports how far it is free. To be as careful as ours: stop {MARGIN:g} m before what stands there, wait where a
way that was watched has had no report for {STALE:g} s, fly no faster than the `horizon` allows
([obstacles.md](obstacles.md)). Who does not read the reports flies unwatched, as ours does without a depth map.

**The fence** is told once, as an event, and kept by the publisher for those who come later: the box in which targets
may lie. Ours is the fence less {FENCE_MARGIN:g} m, so that the autopilot's own guard never stops a drone that does as
it was told, and between {LOWEST:g} and {HIGHEST:g} m of height, whatever the fence.
"""
