"""The person and what the person wears: figure, bust, harness and cuff."""
