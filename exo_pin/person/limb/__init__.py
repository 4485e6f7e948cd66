"""The wearer's upper limb: bones, muscle paths and muscle properties, in any pose."""
