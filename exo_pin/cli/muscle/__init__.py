"""Commands on pneumatic muscles."""
