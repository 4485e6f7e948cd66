"""Pictures of mechanisms and their forces."""
