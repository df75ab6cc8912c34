"""What a run leaves behind for people: the history of a mission, its pictures, its recording and its report."""
