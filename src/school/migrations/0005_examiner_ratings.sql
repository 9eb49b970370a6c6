-- Examiners' own ratings of sessions, by which their agreement is measured. A line of an examiner's log, word for word, as in
-- typodont.override.
CREATE TABLE typodont.examiner_rating (
  log text NOT NULL,
  number bigint NOT NULL,
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  examiner text NOT NULL DEFAULT session_user,
  line text NOT NULL,
  sha256 text NOT NULL,
  received_at timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (log, number, sha256)
);
CREATE INDEX examiner_rating_by_session ON typodont.examiner_rating (session_id);

CREATE FUNCTION typodont.note_rating() RETURNS trigger
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
  INSERT INTO typodont.audit (action, session_id) VALUES ('rating received', NEW.session_id);
  RETURN NULL;
END $$;
CREATE TRIGGER audited AFTER INSERT ON typodont.examiner_rating FOR EACH ROW EXECUTE FUNCTION typodont.note_rating();

GRANT SELECT ON typodont.examiner_rating TO typodont_examiner, typodont_registrar;
GRANT INSERT ON typodont.examiner_rating TO typodont_examiner;
ALTER TABLE typodont.examiner_rating ENABLE ROW LEVEL SECURITY;
CREATE POLICY examiner_reads_class ON typodont.examiner_rating FOR SELECT TO typodont_examiner
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY examiner_writes_class ON typodont.examiner_rating FOR INSERT TO typodont_examiner
  WITH CHECK (examiner = session_user AND EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY registrar_reads ON typodont.examiner_rating FOR SELECT TO typodont_registrar USING (true);
