// expect:
type Float
skillset names {
    data start: Float
    data state: Float
    resource lamp {
        state { None in all }
        initial all
        transition { all -> in  in -> None }
    }
    event skill_event { effect lamp -> None }
    event more {
        guard lamp == all
        effect lamp -> in
    }
}
