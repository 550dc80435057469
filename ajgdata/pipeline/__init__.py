"""Jobs of the workflow and work of commands: read files, call functions of values, write files."""
