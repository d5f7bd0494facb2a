"""Inform: show the robot to the user until both can continue (paper 4.4.4)."""

from __future__ import annotations

from engine.state import NEVER_NS, Action, Context, Monitor, On, Run, Until
from states.keys import RESTART


class WarnUser(Action):
    """Show the robot and the stop sign to the user while this state runs (R18, R114)."""

    outcomes = ()
    commands = ("vr",)

    def run(self, ctx: Context) -> Run:
        vr = ctx.part("vr")
        vr.inform(True)
        try:
            while True:
                yield Until(NEVER_NS)
        finally:
            vr.inform(False)


class Restarted(Monitor):
    """`restarted` when the user, having stopped, gives the restart signal (R65, R115)."""

    outcomes = ("restarted",)
    reads = {RESTART: None}

    def run(self, ctx: Context) -> Run:
        while not ctx.events(RESTART):
            yield On(RESTART)
        return "restarted"
