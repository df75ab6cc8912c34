// expect: SW094
skillset calibration {
    resource home {
        state { Lost Searching Found }
        initial Lost
        transition all
    }
    event forget { effect home -> Lost }
    skill find_home {
        precondition lost: home == Lost
        start home -> Searching
        success found { effect home -> Found }
        failure absent { effect home -> Lost }
    }
}
