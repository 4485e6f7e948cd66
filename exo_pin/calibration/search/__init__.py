"""All devices that fit the lengths: starts, descent from all of them at once, exact twins of what is found."""
