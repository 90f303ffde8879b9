"""What is handed out and what is sealed: a case goes in; recorded rows, another run and the truth come out."""
