"""How the page of the functional layer begins: which places can be taken, conventions, and what becomes of it all."""

from __future__ import annotations

from skillwing.onboard.interface.duties import GUIDANCE, VEHICLE
from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.services.bus import EVENT_HISTORY

_DOORS = """\
# The functional layer

What stands between a flying robot and its skills. Everything below the skill managers speaks these topics and no
others, so something else can speak them: a real autopilot, another simulator. Skillset, skill managers, resource
manager and missions stay as they are. This page is made from the code by `skillwing functional-layer >
docs/functional-layer.md`, and tests keep it true: every topic is in it, and who offers and uses it how often is
compared with a robot that runs. `skillwing functional-layer --json-schema` prints it for programs.

```
   skills, missions
        |   commands, status                    resources, data
        v                                              ^
   [guidance] [obstacles] [mapping] [video]        [bridge]          the tables below: "offered by"
        |   setpoints                                  ^
        v                                              |
   [the vehicle]   navigation, flight state, battery, range, sensors and their health
```

## Which places can be taken

| door | what is yours | what stays | for |
|---|---|---|---|
| another **vehicle** | `sim`: where it is and how it is, its sensors, following setpoints, its own failsafes | \
guidance, obstacles, mapping, video, bridge | an autopilot that takes position setpoints with feed-forward, such as \
PX4 in offboard mode; another simulator |
| another **guidance** | the vehicle and `guidance`: commands of skills, the paths flown for them, the fence | \
obstacles, mapping, video, bridge | an autopilot that plans its own ways, as through a vendor's SDK |

A bridge between MAVLink, or whatever the vehicle speaks, and these topics is one process: a node on the robot's bus,
in Python as in the [example](../examples/point_drone/node.py), or in any language that has Zenoh and MessagePack
([protocol.md](protocol.md) tells how to connect, and the rules for payloads; they hold here, too). Skillwing has no
bridge to MAVLink; what is said of it below is where its messages belong, and has not been flown.

**The proof** is [examples/point_drone](../examples/point_drone/robot.py): a vehicle of less than 250 lines, without
MuJoCo, in wall time, under the very skill managers, guidance and bridge of the M600. `skillwing up --robot
./examples/point_drone` starts it. It takes off, flies to points, turns, holds a heading, hovers, circles,
comes home and lands; depth maps, mapping and video say which sensor they miss.

## What each skill needs

Besides navigation and flight state, without which nothing flies. The managers themselves use:

| skill | asks | follows |
|---|---|---|
| `takeoff` | `fl/guidance/command` | `fl/geofence`, `fl/guidance/status`, `fl/navigation` |
| `land` | `fl/guidance/command`, `fl/obstacles/landing` | `fl/flight`, `fl/guidance/status`, `fl/navigation` |
| `hover` | `fl/guidance/command` | `fl/guidance/status` |
| `goto` | `fl/guidance/command` | `fl/geofence`, `fl/guidance/status`, `fl/navigation` |
| `goto_straight` | `fl/guidance/command` | `fl/geofence`, `fl/guidance/status`, `fl/navigation` |
| `return_home` | `fl/guidance/command` | `fl/geofence`, `fl/guidance/status`, `fl/navigation` |
| `inspect` | `fl/guidance/command` | `fl/geofence`, `fl/guidance/status` |
| `rotate_head` | `fl/guidance/command` | `fl/guidance/status` |
| `lock_head` | `fl/guidance/command` | `fl/guidance/status` |
| `zed_depthmap` | `fl/obstacles/command` | `fl/obstacles/status` |
| `lidar_depthmap` | `fl/obstacles/command` | `fl/obstacles/status` |
| `lidar_mapping` | `fl/mapping/command` | `fl/mapping/status` |
| `stream` | `fl/video/command` | `fl/video/encoder`, `fl/video/status` |

A vehicle without cameras serves the first nine. `zed_depthmap` wants `fl/zed/depth` and the health of `zed` from it,
`lidar_depthmap` `fl/lidar` and the health of `lidar`, `lidar_mapping` `fl/imu` as well, `stream` the camera and a
`fl/link/status`.
"""

_CONVENTIONS = f"""\
## Frames, units, time

The world is ENU: x east, y north, z up, in metres, **with the origin at the home pad**: `takeoff(height=5)` flies to
z = 5, and `return_home` to x = y = 0. The body is FLU: x forward, y left, z up (REP 103). Headings are radians
counter-clockwise from east, quaternions (w, x, y, z) turn body into world. No component may be beyond
±{LARGEST_COMPONENT:g}, none may be NaN. Most autopilots speak NED and FRD, with headings clockwise from north:

```py
from math import pi, remainder, sqrt, tau


def enu(ned):
    north, east, down = ned
    return east, north, -down


def flu(frd):
    forward, right, down = frd
    return forward, -right, -down


def heading(from_north):
    return remainder(pi / 2 - from_north, tau)


def attitude(w, x, y, z):
    \"\"\"FRD to NED becomes FLU to ENU.\"\"\"
    return (w + z) / sqrt(2), (x + y) / sqrt(2), (x - y) / sqrt(2), (w - z) / sqrt(2)
```

Each is its own inverse. Subtract the home pad from positions.

**Time.** `t` is robot time in seconds, and there is one for the whole robot. Where a simulator makes it, the table
says `clock="robot"` and the simulator publishes `fl/clock`; a vehicle in the real world says `clock="wall"`,
publishes no clock, and stamps with Unix time. Stamps are compared with the clocks of the computers that guidance and
the managers run on, so all of them have to agree (chrony, PTP; for an autopilot without such a clock, MAVLink's
TIMESYNC): to 0.1 s, for a manager believes no report that is stamped less than 0.15 s after its command was taken,
and data whose stamps lie three periods back are stale. Stamp what was measured with when it was measured.

**Streams** may lose publications: of those who fall behind, each gets the newest. **Events** lose none: an advanced
publisher keeps the last {EVENT_HISTORY} for whoever comes later. **Array streams** carry raw bytes in the payload and
their header as Zenoh attachment. **Queries** are answered with a reply or a typed refusal, at once and always:
silence means that nobody knows, and is asked again with the same goal id.
"""

_BRIDGE = """\
## What becomes of it above

The bridge (`skillwing.m600.bridge`) is the only one that knows both sides. Resources follow the vehicle by level:
what is put elsewhere comes back within 0.5 s.

| of the functional layer | resource, datum |
|---|---|
| `fl/flight`: `authority` | `SDK_authority`; UNAVAILABLE also after 2 s of silence |
| `fl/flight`: `on_ground`, `home_valid` | `flight_status`, `homepoint_status` |
| `fl/flight`: `failsafe` | no resource; a record of the timeline |
| `fl/navigation` | `position`, `velocity`, `heading` |
| `fl/battery` | `battery`; `battery_status`: LOW below 30 %, CRITICAL below 15 %, better with 3 % more |
| `fl/health/zed`, `fl/health/lidar` | `zed_status`, `lidar_status`; all health goes to the timeline, with its `id` \
as the record's |
| `fl/link/status` | `link_bandwidth`; `link_status` by what gets through: DEGRADED below 0.5 Mbit/s, LOST below 0.05 |
| `fl/obstacles/status` | `obstacle_distance` |
| `fl/mapping/status`, `fl/mapping/map` | `map_statistics` |
| `fl/video/status` | `video_quality` |

Data go on at the periods that the skillset promises, and only with news: a measurement is told once. After three
periods without one the datum is stale, every guard that names it counts as false, and running goals whose invariants
name it end.

Until a topic has spoken its resources keep the states that the skillset begins with: no authority, no home point, on
the ground, sensors UNKNOWN. So nothing flies before the vehicle has said that it may. **Two of them begin well**:
`battery_status` NORMAL and `link_status` GOOD. A vehicle that never tells its battery takes off all the same, and one
whose battery falls silent in flight is not brought home for it; tell it, or add `data=(battery > 15.0)` to the
skills.

## Putting it into a robot's table

```py
from skillwing.m600.generated.processes import HOOKS, SKILLSET
from skillwing.services.robot import ProcessSpec, Robot


def functional_layer(options):
    return (
        ProcessSpec("vehicle", "my_drone.mavlink:make_vehicle", {"port": "/dev/ttyUSB0"}),
        ProcessSpec("guidance", "skillwing.onboard.guidance.node:make_guidance"),
        ProcessSpec("bridge", "skillwing.m600.bridge.node:make_bridge", {"skillset": str(SKILLSET)}),
    )


ROBOT = Robot(name="my_drone", skillset=SKILLSET, hooks=HOOKS, functional_layer=functional_layer, clock="wall")
```

as `my_drone/robot.py`; `skillwing up --robot ./my_drone` starts it ([robots.md](robots.md)). `options` are those of
the run: `seed`, `speed` and `faults` mean nothing to a real vehicle. A process that runs on another computer, or was
there before, stands in no table; it only needs the router's address. Say `restart="never"` where a new process could
not take up where the old one ended, and `essential=False` where the robot can go on without it.

A table without the obstacle node, mapping or video serves the skills that do not need them. `skillwing fault` and
`skillwing pilot` are for simulated vehicles; those who serve `fl/pilot` can be tried with it, as the example can.
"""

OPENING = "\n".join([_DOORS, _CONVENTIONS, VEHICLE, GUIDANCE, _BRIDGE])
