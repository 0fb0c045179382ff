"""What an answer says, as data: sentences, tables, figures; no medium, no question."""
