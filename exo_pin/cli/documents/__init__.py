"""Documents of commands: their records, their schemas, and questions in JSON lines."""
