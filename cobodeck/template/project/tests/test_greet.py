"""The chart in virtual time, with a scripted arm and the real monitor."""


def test_it_waits_until_somebody_comes_near(sim):
    sim.start("greet", script={"park": "parked"}, real=["PersonNear"])
    sim.series("user.distance", {0: 3.0, 5: 2.0})  # 3 m, and after 5 s 2 m
    sim.until("stay", timeout=1)
    sim.wait(4)
    assert sim.outcome is None
    sim.until("met", timeout=1)
    sim.assert_path("park", "stay")


def test_an_arm_that_cannot_be_parked_is_a_failure(sim):
    sim.start("greet", script={"park": "failed"})
    sim.until("failed", timeout=1)


def test_it_greets_somebody_in_the_room(sim):
    sim.start("greet", scene="room", profile="calm")
    sim.until("met", timeout=60)
