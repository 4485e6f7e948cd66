"""Commands on workspaces: what a design reaches, and the search for a better one."""
