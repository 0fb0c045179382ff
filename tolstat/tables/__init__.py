"""Tables in files as other programs write them: text, workbooks, Q-DAS."""
