"""A small arm as SDF, which tests change in places."""

ARM = """<sdf version="1.9"><model name="arm">
  <link name="base"/><link name="upper"><pose>0 0 1 0 0 0</pose><inertial><mass>2</mass></inertial></link>
  <link name="fore"><pose relative_to="upper">0.5 0 0 0 0 0</pose></link><frame name="tip" attached_to="fore"/>
  <joint name="weld" type="fixed"><parent>world</parent><child>base</child></joint>
  <joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child><axis><xyz>0 1 0</xyz></axis></joint>
  <joint name="elbow" type="prismatic"><parent>upper</parent><child>fore</child><axis><xyz>1 0 0</xyz></axis></joint>
</model></sdf>"""
SHOULDER, ELBOW = "<axis><xyz>0 1 0</xyz></axis>", "<axis><xyz>1 0 0</xyz></axis>"
