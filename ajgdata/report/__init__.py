"""Results -> figures and one offline page. Nothing here opens a file of the workflow."""
