"""A dimension chain: links, and the gap that they leave, as a formula."""
