"""Motion capture as it comes: files and folders of any source, read, named and set upright."""
