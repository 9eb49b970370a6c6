"""Reads a partitioned export with DuckDB and pandas, and compares it with the sessions it was made of.

    read_partitions.py TABLES BUNDLES
"""

import json
import pathlib
import sys

import duckdb
import pandas


def main(arguments):
    tables, bundles = map(pathlib.Path, arguments)
    written = {path.parent.name: json.loads(path.read_text()) for path in bundles.glob("*/*/session.json")}
    classes = {path.parent.name: path.parent.parent.name for path in bundles.glob("*/*/session.json")}
    for sessions, metrics in (by_duckdb(tables), by_pandas(tables)):
        assert len(sessions) == len(written) and sessions["session_id"].is_unique, sessions
        assert len(metrics) == sum(len(session["metrics"]) for session in written.values())
        for row in sessions.to_dict("records"):
            session = written[row["bundle"]]
            assert row["participant"] == session["participant"] and row["points"] == session["grade"]["points"], row
            assert row["class"] == classes[row["bundle"]], row
            began = session["started"][:7] if session["started"][:1] == "2" else "unknown"
            assert str(row["month"]) == began, row
        joined = metrics[metrics["metric"] == "decay_cleared_pct"].merge(sessions, on="session_id")
        values = [session["metrics"]["decay_cleared_pct"] for session in written.values()]
        assert abs(joined["value"].mean() - sum(values) / len(values)) < 1e-9
    print(f"{len(sessions)} sessions, {len(metrics)} measures", file=sys.stderr)


def by_duckdb(tables):
    def read(name):
        query = f"SELECT * FROM read_parquet('{tables}/{name}/*/*/*.parquet', hive_partitioning = true, hive_types_autocast = false)"
        return duckdb.sql(query).df()

    return read("sessions"), read("metrics")


def by_pandas(tables):
    return tuple(pandas.read_parquet(tables / name, engine="pyarrow") for name in ("sessions", "metrics"))


if __name__ == "__main__":
    main(sys.argv[1:])
