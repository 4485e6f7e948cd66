"""A small robot as MJCF, with places where a test writes something in."""

from exo_pin.chain import ClosedChain

ARM = """<mujoco model="arm"><compiler angle="radian"/>OPTION<worldbody>
  <body name="a"><joint name="ja" axis="0 0 1" JA/><geom size="0.1" pos="0.2 0 0"/>INA
    <body name="b" pos="0.5 0 0"><joint name="jb" type="slide" axis="0 1 0" JB/><geom size="0.1"/>
      <site name="s" pos="0 0 0.1"/>INB</body></body>
  <body name="c" pos="0 0 1"><joint name="jc" type="ball" JC/><geom size="0.1 0.05 0.02" type="box"/></body>
  WORLD</worldbody>MORE</mujoco>"""


def arm(**parts):
    text = ARM
    for key in ("OPTION", "JA", "JB", "JC", "INA", "INB", "WORLD", "MORE"):
        text = text.replace(key, parts.pop(key.lower(), ""), 1)
    assert not parts
    return text


def read(**parts):
    return ClosedChain.from_mjcf(arm(**parts))
