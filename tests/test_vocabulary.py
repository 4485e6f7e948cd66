"""One word for the arm's poses in every public function."""

import importlib
import inspect
import pkgutil

import exo_pin as ep

#: A sensor's reading and a plant's state at one instant, and the glenoid's axes, are no poses that are asked for.
OTHER = {"GlenoidCone", "GlenoidCone.circular", "ImuReading", "Measurement", "ReferenceState"}
#: They hand on what a scene takes, of a wrist or of a chain, which have other arguments.
HANDED_ON = {"ShoulderExo.view"}
#: Other words for poses and limits.
OTHER_WORDS = {"orientation", "orientations", "actuator_bounds"}
ROOMS = ["exo_pin", *(f"exo_pin.{each.name}" for each in pkgutil.iter_modules(ep.__path__) if each.ispkg)]


def public_callables():
    """Each public function, class and method of the rooms that have a list of public names, once, by name."""
    found = {}
    for room in map(importlib.import_module, ROOMS):
        for thing in (getattr(room, name) for name in getattr(room, "__all__", ())):
            if inspect.isfunction(thing) or inspect.isclass(thing):
                found[thing.__name__] = thing
            if inspect.isclass(thing) and thing.__module__.startswith("exo_pin"):
                for name, member in inspect.getmembers(thing, callable):
                    if not name.startswith("_") and (getattr(member, "__module__", None) or "").startswith("exo_pin"):
                        found[f"{thing.__name__}.{name}"] = member
    return found


def parameters(thing):
    try:
        return inspect.signature(thing).parameters.values()
    except ValueError:  # an enumeration or an exception made in C
        return ()


def test_no_public_function_takes_another_word_or_options_without_types():
    things = public_callables()
    assert {"ShoulderExo.reaction", "Person.joint_contact", "calibrate", "Movement"} <= set(things)
    old = {
        f"{name}({parameter.name})"
        for name, thing in things.items()
        for parameter in parameters(thing)
        if (parameter.name in OTHER_WORDS and name not in OTHER)
        or (
            parameter.kind is parameter.VAR_KEYWORD
            and (parameter.name == "options" and name not in HANDED_ON)
            and "Any" in str(parameter.annotation)
        )
    }
    assert not old, sorted(old)


def test_poses_motion_and_load_come_in_this_order():
    order = ["poses", "motion", "load"]
    for name, thing in public_callables().items():
        given = [parameter.name for parameter in parameters(thing) if parameter.kind is not parameter.KEYWORD_ONLY]
        asked = [word for word in given if word in order]
        assert asked == [word for word in order if word in asked], name
