// expect: SW013 SW010 SW011 SW013 SW010
type Float
skillset names {
    data x: Flaot
    resource lamp {
        state { Off On }
        initial Off
        transition all
    }
    skill shine {
        precondition dark: lmp == Off
        start lamp -> Onn
        output heat: Temperature
        success shone { effect light -> Off }
    }
}
