// expect: SW055 SW050
skillset meaning {
    resource lamp {
        state { Off On }
        initial Off
        transition all
    }
    event never {
        guard lamp == On and lamp == Off
        effect lamp -> On
    }
    skill shine {
        precondition both: lamp == On and lamp == Off
        success shone {
            effect lamp -> On
        }
    }
}
