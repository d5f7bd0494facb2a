"""The process that moves a UR arm; only it uses ur_rtde, whose calls may block or crash.

It streams `servoJ` along the trajectory, one set-point per package of the controller, and reports
joints and faults by datagrams. The engine sends `here` (stamped by the last tick; its value says
why nothing may move, or is None), `follow` (a trajectory in pieces), `pace` and `stop`; late or
reordered datagrams are dropped. Set-points are sent while the newest `here` is fresh and permits
motion; the controller's watchdog ends its program when they stop.

A fault is final: this process sends no set-point after it, and a new one has to be started.
"""

from __future__ import annotations

import os
import select
import time
from collections.abc import Sequence
from typing import Any

from hw.drivers.gates import CONTROLLER_STALE_NS, ENGINE_GONE_NS, TICK_FRESH_NS
from hw.drivers.ur.course import CourseRun, mode_of
from hw.drivers.ur.probe import OTHER_DRIVER, DashboardClient, probe, require_running
from hw.drivers.ur.ur_settings import WorkerSettings
from hw.ipc import ARM, Datagram, Intake, Outlet, Parent, Ready, serve
from hw.samples import ARM_MOVES, ArmState, Joints, TimedJoints

LOOK_S = 0.002
LINK_NS = 20_000_000
"""Period of reports on the link, ns."""
WATCHDOG_HZ = 10.0
LONGEST_S = 0.04
"""Longest step between two set-points, s."""
STANDS = 0.005
"""Joint speed below which a joint counts as standing, rad/s."""
BEGINS = 0.01
"""Greatest distance of the arm from the first point of a trajectory, rad."""
PLAYING = 2
ALONE_NS = 500_000_000
"""Motion without a command for longer is another program's, ns; our own ends sooner."""
PERIOD_S = 0.008
VARIABLES = (
    "timestamp", "actual_q", "actual_qd", "runtime_state", "safety_status_bits", "speed_scaling",
    "target_speed_fraction",
)  # fmt: skip


class UrController:
    """The robot through ur_rtde; single-threaded.

    Raises:
        OSError: it cannot be reached, or may not move.
    """

    def __init__(self, settings: WorkerSettings) -> None:
        from rtde_control import RTDEControlInterface  # type: ignore[import-not-found]
        from rtde_receive import RTDEReceiveInterface  # type: ignore[import-not-found]

        self._servo = settings.servo
        self.version = probe(settings.host)
        self._dashboard = DashboardClient(settings.host)
        try:
            require_running(self._dashboard, settings.acknowledged)
            self._receive = RTDEReceiveInterface(settings.host, 125.0, list(VARIABLES))
            self._control = RTDEControlInterface(settings.host, 125.0)
            if not self._control.setWatchdog(WATCHDOG_HZ):
                raise OSError("the controller refuses the watchdog")
            if not self._control.setPayload(settings.mass, list(settings.center)):
                raise OSError("the controller does not take the payload")
        except RuntimeError as error:
            raise OSError(f"{settings.host}: {_error_text(str(error))}") from None

    @property
    def stamp(self) -> float:
        """The controller's own time, s; it stands still if the link is lost."""
        return float(self._receive.getTimestamp())

    def measured(self) -> tuple[Joints, Joints]:
        """Joint angles and velocities, rad and rad/s."""
        return tuple(self._receive.getActualQ()), tuple(self._receive.getActualQd())

    def safety(self) -> int:
        """The safety status bits."""
        return int(self._receive.getSafetyStatusBits())

    def scaling(self) -> float:
        """Share of its commanded speed at which it runs."""
        share = self._receive.getSpeedScaling() * self._receive.getTargetSpeedFraction()
        return min(1.0, max(0.0, float(share)))

    def playing(self) -> bool:
        """True while our script runs."""
        return int(self._receive.getRuntimeState()) == PLAYING

    def servo(self, joints: Sequence[float]) -> bool:
        """Send a set-point; False if it was not accepted."""
        ahead, gain = self._servo.lookahead, self._servo.gain
        return bool(self._control.servoJ(list(joints), 0.0, 0.0, PERIOD_S, ahead, gain))

    def kick(self) -> None:
        """Reset the watchdog without a set-point."""
        self._control.kickWatchdog()

    def end(self) -> None:
        """End the running program without waiting, so that nothing resumes by itself."""
        self._dashboard.order("stop")


class Worker:
    """Follows trajectories, from one package of the controller to the next."""

    def __init__(self, controller: UrController, settings: WorkerSettings, outlet: Outlet) -> None:
        self.fault: str | None = None
        self._controller, self._settings, self._outlet = controller, settings, outlet
        self._run: CourseRun | None = None
        self._target: Joints | None = None
        self._pieces: list[TimedJoints] = []
        self._course = settings.course
        self._pace = 1.0
        self._refused: str | None = "the arm was lost" if settings.acknowledged else None
        self._held: str | None = "nothing received from the engine yet"
        self._ticked = self._heard = 0
        self._stamp, self._advanced = controller.stamp, time.monotonic_ns()
        self._linked, self._ours_ns = 0, self._advanced
        self._measured = controller.measured()

    @property
    def stands(self) -> bool:
        """True if nothing is commanded and no joint moves."""
        return self._run is None and not any(abs(v) > STANDS for v in self._measured[1])

    def gone(self, now_ns: int) -> bool:
        """True if the engine has been silent for too long."""
        return self._heard > 0 and now_ns - self._heard > ENGINE_GONE_NS

    def break_off(self, reason: str | None) -> None:
        """Brake along the path; `reason` is reported as the refusal, None: it was commanded."""
        if self._run is not None:
            self._run.stop()
            self._refused = self._refused or reason

    # ---- orders

    def on_datagram(self, datagram: Datagram, now_ns: int) -> None:
        """Take a datagram of the engine; one that is not as agreed is ignored."""
        self._heard = now_ns
        late = now_ns - datagram.stamp_ns > TICK_FRESH_NS
        match datagram.name, datagram.value:
            case "here", str() | None as held:
                self._ticked, self._held = min(datagram.stamp_ns, now_ns), held
                if held is not None:
                    self.break_off(held)
            case "pace", (float() | int()) as share if 0.0 <= share <= 1.0:
                self._pace = float(share)
            case "stop", None:
                self._pieces = []
                self.break_off(None)
            case "follow", (int(number), int(first), int(count), tuple(points)):
                whole = first == len(self._pieces) or first == 0
                self._pieces = [*(self._pieces if first else ()), *points] if whole else []
                if first + len(points) == count:
                    self._follow(number, "the trajectory arrived late" if late else None, count)

    def _follow(self, number: int, late: str | None, count: int) -> None:
        points, self._pieces = self._pieces, []
        refused = late or self._refusal(points)
        if len(points) < count:
            refused = "the trajectory was stopped before it was complete"
        self.break_off(None)
        self._course, self._refused = number, refused
        if refused is None and len(points) > 1:
            self._run = CourseRun(points, self._settings.model.stop_deceleration)
            self._pace = 1.0

    def _refusal(self, points: Sequence[TimedJoints]) -> str | None:
        reason = self.fault or self._held
        if reason is not None:
            return reason
        if not self.stands:
            return "the arm moves"
        try:
            self._settings.model.check_course(points)
        except (ValueError, TypeError, LookupError) as error:
            return str(error)
        pairs = zip(points[0][1], self._measured[0], strict=True)
        away = max(abs(a - b) for a, b in pairs)
        return None if away <= BEGINS else f"the arm stands {away:.3f} rad from its start"

    # ---- packages

    def look(self, now_ns: int) -> None:
        """Take a new package, if any, and answer it with a set-point; detect faults."""
        stamp = self._controller.stamp
        if stamp > self._stamp:
            span, self._stamp, self._advanced = stamp - self._stamp, stamp, now_ns
            self._package(min(span, LONGEST_S), now_ns)
        elif now_ns - self._advanced > CONTROLLER_STALE_NS:
            self._fail("the controller's time stands still")
        if now_ns - self._linked >= LINK_NS:
            self._tell_link(now_ns)

    def _package(self, span: float, now_ns: int) -> None:
        controller = self._controller
        self._measured = controller.measured()
        mode, scaling = mode_of(controller.safety()), controller.scaling()
        if mode not in ARM_MOVES:
            self._fail(mode.replace("_", " "))
        elif not controller.playing():
            self._fail(
                f"its control script has ended, at the pendant or by another; {OTHER_DRIVER}"
            )
        elif self._moves_alone(now_ns):
            self._fail(f"it moves without a command of ours; {OTHER_DRIVER}")
        if self.fault is None:
            self._set_point(span, scaling, now_ns)
        joints, velocities = self._measured
        share = scaling if self._run is None else self._run.rate
        state = ArmState(
            joints, velocities, not self.stands, self._course, self._refused, mode, share
        )
        self._outlet.send("arm.joints", now_ns, state)

    def _moves_alone(self, now_ns: int) -> bool:
        """True if it moves although nothing has been commanded for a while."""
        if self._run is not None or self.stands:
            self._ours_ns = now_ns
        return now_ns - self._ours_ns > ALONE_NS

    def _set_point(self, span: float, scaling: float, now_ns: int) -> None:
        run, silent = self._run, now_ns - self._ticked
        if run is None:
            self._controller.kick()
            return
        if silent > ENGINE_GONE_NS:
            self.break_off("the engine has been silent")
        joints = run.step(span, self._pace * scaling if silent <= TICK_FRESH_NS else 0.0)
        if not self._controller.servo(joints):
            self._fail("a set-point was not taken")
        if run.over:
            self._run = None

    def _fail(self, reason: str) -> None:
        """Send no more set-points, and end the controller's program."""
        if self.fault is not None:
            return
        self.fault = reason
        if self._run is not None:
            self._refused, self._run = self._refused or reason, None
        self._controller.end()
        self._tell_link(time.monotonic_ns())

    def _tell_link(self, now_ns: int) -> None:
        self._linked = now_ns
        self._outlet.send("arm.link", now_ns, self.fault)


def _error_text(error: str) -> str:
    """An error of the client library; registers in use may be another client's, too."""
    if "already in use" not in error:
        return error
    return f"{error} Or another client has registers: {OTHER_DRIVER}"


def main(settings: WorkerSettings, ready: Ready, parent: Parent) -> None:
    """Move the arm until the parent has gone; then stop it, and end its program."""
    controller = UrController(settings)
    outlet, orders = Outlet(settings.tells), Intake(("engine",))
    worker = Worker(controller, settings, outlet)
    ready({"orders": orders.door("engine"), "version": controller.version})
    left = 0
    while not (left and (worker.stands or time.monotonic_ns() - left > ENGINE_GONE_NS)):
        waited: list[Any] = [orders, *([] if left else [parent])]
        found, _, _ = select.select(waited, [], [], LOOK_S)
        now = time.monotonic_ns()
        if not left and (parent in found or worker.gone(now)):
            left = now
        for datagram in orders.poll():
            worker.on_datagram(datagram, now)
        if left:
            worker.break_off("the engine has gone")
        worker.look(now)
    controller.end()
    os._exit(0)  # the library's shutdown takes half a second, or fails


if __name__ == "__main__":
    serve(main, ARM, locked=True)
