"""The figures of a board, from pins to a turning motor: `make board`."""
