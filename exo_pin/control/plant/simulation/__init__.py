"""The plant in time: in minimal coordinates, and to rest."""
