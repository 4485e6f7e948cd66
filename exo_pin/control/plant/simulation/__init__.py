"""The plant in time: in minimal coordinates, as the closed chain, and to rest."""
