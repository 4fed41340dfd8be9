"""Rows of the CSV files of `mbsopt tradeoff`, and of data/tradeoffs/."""

import csv
import math


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write_rows(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def number(text):
    return float(text) if text not in ("", None) else math.nan


def short(text):
    """Three digits are enough for what varies from run to run."""
    try:
        return f"{float(text):.3g}"
    except ValueError:
        return text
