"""The history of a run: records and goals, folded into skill bars, resource lanes and chains of causes."""
