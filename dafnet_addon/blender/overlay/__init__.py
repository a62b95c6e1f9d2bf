"""What is drawn over the viewport and in the timeline."""
